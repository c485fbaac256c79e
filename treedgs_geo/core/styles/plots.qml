<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis simplifyDrawingTol="1" labelsEnabled="0" simplifyLocal="1" simplifyDrawingHints="1" simplifyAlgorithm="0" simplifyMaxScale="1" symbologyReferenceScale="-1" minScale="100000000" version="3.22.16-Białowieża" styleCategories="LayerConfiguration|Symbology|Labeling|Fields|Forms|MapTips|AttributeTable|Rendering" hasScaleBasedVisibilityFlag="0" maxScale="0" readOnly="0">
  <flags>
    <Identifiable>1</Identifiable>
    <Removable>1</Removable>
    <Searchable>1</Searchable>
    <Private>0</Private>
  </flags>
  <renderer-v2 type="categorizedSymbol" referencescale="-1" enableorderby="0" attr="status" forceraster="0" symbollevels="0">
    <categories>
      <category symbol="0" value="auto" render="true" label="placed"/>
      <category symbol="1" value="ok" render="true" label="confirmed by hand"/>
      <category symbol="2" value="check" render="true" label="needs a hand check"/>
    </categories>
    <symbols>
      <symbol type="fill" force_rhr="0" clip_to_extent="1" alpha="1" name="0">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="border_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="color" value="0,0,255,255"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="85,85,85,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.4"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="style" value="no"/>
          </Option>
          <prop k="border_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="color" v="0,0,255,255"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="85,85,85,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.4"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="style" v="no"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="fill" force_rhr="0" clip_to_extent="1" alpha="1" name="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="border_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="color" value="0,0,255,255"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="46,139,61,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.6"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="style" value="no"/>
          </Option>
          <prop k="border_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="color" v="0,0,255,255"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="46,139,61,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.6"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="style" v="no"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="fill" force_rhr="0" clip_to_extent="1" alpha="1" name="2">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="border_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="color" value="0,0,255,255"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="106,61,154,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.9"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="style" value="no"/>
          </Option>
          <prop k="border_width_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="color" v="0,0,255,255"/>
          <prop k="joinstyle" v="bevel"/>
          <prop k="offset" v="0,0"/>
          <prop k="offset_map_unit_scale" v="3x:0,0,0,0,0,0"/>
          <prop k="offset_unit" v="MM"/>
          <prop k="outline_color" v="106,61,154,255"/>
          <prop k="outline_style" v="solid"/>
          <prop k="outline_width" v="0.9"/>
          <prop k="outline_width_unit" v="MM"/>
          <prop k="style" v="no"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
    </symbols>
    <rotation/>
    <sizescale/>
  </renderer-v2>
  <blendMode>0</blendMode>
  <featureBlendMode>0</featureBlendMode>
  <layerOpacity>1</layerOpacity>
  <fieldConfiguration>
    <field name="plot_id" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="status" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" name="placed" value="auto"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="confirmed by hand" value="ok"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="needs a hand check" value="check"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="reason" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="offset_e_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="offset_n_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="rot_deg" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="ratio" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="margin" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="residual_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="share" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_field" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_measured" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_pairs" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_sugg" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="radius_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="x" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="y" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="fid" configurationFlags="None">
      <editWidget type="Hidden">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias name="Plot" field="plot_id" index="0"/>
    <alias name="Status" field="status" index="1"/>
    <alias name="Reason" field="reason" index="2"/>
    <alias name="Moved east [m]" field="offset_e_m" index="3"/>
    <alias name="Moved north [m]" field="offset_n_m" index="4"/>
    <alias name="Turned clockwise [°]" field="rot_deg" index="5"/>
    <alias name="Score over the next best placing" field="ratio" index="6"/>
    <alias name="Log-likelihood over the next best placing" field="margin" index="7"/>
    <alias name="Residual of the pairs [m]" field="residual_m" index="8"/>
    <alias name="Share of trees with a partner within 1 m" field="share" index="9"/>
    <alias name="Field trees" field="n_field" index="10"/>
    <alias name="Measured trees in the circle" field="n_measured" index="11"/>
    <alias name="Pairs" field="n_pairs" index="12"/>
    <alias name="Suggestions" field="n_sugg" index="13"/>
    <alias name="Radius [m]" field="radius_m" index="14"/>
    <alias name="Easting of the centre, co-registered [m]" field="x" index="15"/>
    <alias name="Northing of the centre, co-registered [m]" field="y" index="16"/>
    <alias name="" field="fid" index="17"/>
  </aliases>
  <defaults>
    <default expression="" field="plot_id" applyOnUpdate="0"/>
    <default expression="" field="status" applyOnUpdate="0"/>
    <default expression="" field="reason" applyOnUpdate="0"/>
    <default expression="" field="offset_e_m" applyOnUpdate="0"/>
    <default expression="" field="offset_n_m" applyOnUpdate="0"/>
    <default expression="" field="rot_deg" applyOnUpdate="0"/>
    <default expression="" field="ratio" applyOnUpdate="0"/>
    <default expression="" field="margin" applyOnUpdate="0"/>
    <default expression="" field="residual_m" applyOnUpdate="0"/>
    <default expression="" field="share" applyOnUpdate="0"/>
    <default expression="" field="n_field" applyOnUpdate="0"/>
    <default expression="" field="n_measured" applyOnUpdate="0"/>
    <default expression="" field="n_pairs" applyOnUpdate="0"/>
    <default expression="" field="n_sugg" applyOnUpdate="0"/>
    <default expression="" field="radius_m" applyOnUpdate="0"/>
    <default expression="" field="x" applyOnUpdate="0"/>
    <default expression="" field="y" applyOnUpdate="0"/>
    <default expression="" field="fid" applyOnUpdate="0"/>
  </defaults>
  <constraints>
    <constraint unique_strength="0" exp_strength="0" field="plot_id" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="status" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="reason" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="offset_e_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="offset_n_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="rot_deg" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="ratio" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="margin" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="residual_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="share" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="n_field" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="n_measured" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="n_pairs" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="n_sugg" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="radius_m" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="x" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="y" notnull_strength="0" constraints="0"/>
    <constraint unique_strength="0" exp_strength="0" field="fid" notnull_strength="0" constraints="0"/>
  </constraints>
  <constraintExpressions>
    <constraint desc="" field="plot_id" exp=""/>
    <constraint desc="" field="status" exp=""/>
    <constraint desc="" field="reason" exp=""/>
    <constraint desc="" field="offset_e_m" exp=""/>
    <constraint desc="" field="offset_n_m" exp=""/>
    <constraint desc="" field="rot_deg" exp=""/>
    <constraint desc="" field="ratio" exp=""/>
    <constraint desc="" field="margin" exp=""/>
    <constraint desc="" field="residual_m" exp=""/>
    <constraint desc="" field="share" exp=""/>
    <constraint desc="" field="n_field" exp=""/>
    <constraint desc="" field="n_measured" exp=""/>
    <constraint desc="" field="n_pairs" exp=""/>
    <constraint desc="" field="n_sugg" exp=""/>
    <constraint desc="" field="radius_m" exp=""/>
    <constraint desc="" field="x" exp=""/>
    <constraint desc="" field="y" exp=""/>
    <constraint desc="" field="fid" exp=""/>
  </constraintExpressions>
  <expressionfields/>
  <attributetableconfig sortOrder="0" sortExpression="" actionWidgetStyle="dropDown">
    <columns>
      <column type="field" name="plot_id" hidden="0" width="88"/>
      <column type="field" name="status" hidden="0" width="70"/>
      <column type="field" name="reason" hidden="0" width="70"/>
      <column type="field" name="offset_e_m" hidden="0" width="184"/>
      <column type="field" name="offset_n_m" hidden="0" width="192"/>
      <column type="field" name="rot_deg" hidden="0" width="232"/>
      <column type="field" name="ratio" hidden="0" width="368"/>
      <column type="field" name="margin" hidden="0" width="424"/>
      <column type="field" name="residual_m" hidden="0" width="224"/>
      <column type="field" name="share" hidden="0" width="384"/>
      <column type="field" name="n_field" hidden="0" width="128"/>
      <column type="field" name="n_measured" hidden="0" width="232"/>
      <column type="field" name="n_pairs" hidden="0" width="70"/>
      <column type="field" name="n_sugg" hidden="0" width="88"/>
      <column type="field" name="radius_m" hidden="0" width="80"/>
      <column type="field" name="x" hidden="0" width="320"/>
      <column type="field" name="y" hidden="0" width="328"/>
      <column type="field" name="fid" hidden="1" width="70"/>
      <column type="actions" hidden="0" width="70"/>
    </columns>
  </attributetableconfig>
  <conditionalstyles>
    <rowstyles/>
    <fieldstyles/>
  </conditionalstyles>
  <storedexpressions/>
  <editform tolerant="1"></editform>
  <editforminit/>
  <editforminitcodesource>0</editforminitcodesource>
  <editforminitfilepath></editforminitfilepath>
  <editforminitcode><![CDATA[]]></editforminitcode>
  <featformsuppress>0</featformsuppress>
  <editorlayout>generatedlayout</editorlayout>
  <editable>
    <field editable="0" name="fid"/>
    <field editable="1" name="margin"/>
    <field editable="1" name="n_field"/>
    <field editable="1" name="n_measured"/>
    <field editable="1" name="n_pairs"/>
    <field editable="1" name="n_sugg"/>
    <field editable="1" name="offset_e_m"/>
    <field editable="1" name="offset_n_m"/>
    <field editable="1" name="plot_id"/>
    <field editable="1" name="radius_m"/>
    <field editable="1" name="ratio"/>
    <field editable="1" name="reason"/>
    <field editable="1" name="residual_m"/>
    <field editable="1" name="rot_deg"/>
    <field editable="1" name="share"/>
    <field editable="1" name="status"/>
    <field editable="1" name="x"/>
    <field editable="1" name="y"/>
  </editable>
  <labelOnTop/>
  <reuseLastValue/>
  <dataDefinedFieldProperties/>
  <widgets/>
  <previewExpression>"plot_id"</previewExpression>
  <mapTip>&lt;b>[% (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'Probefläche' WHEN left(@qgis_locale, 2) = 'es' THEN 'Parcela' ELSE 'Plot' END) %] [% replace(replace(replace("plot_id", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;') %]&lt;/b> ([% replace(replace(replace("status", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;') %])&lt;br>[% (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'gepaarte Feldbäume' WHEN left(@qgis_locale, 2) = 'es' THEN 'árboles de campo emparejados' ELSE 'field trees paired' END) %]: [% "n_pairs" %] / [% "n_field" %][% coalesce('&lt;br>' || (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'verschoben nach Ost, Nord' WHEN left(@qgis_locale, 2) = 'es' THEN 'movida al este, norte' ELSE 'moved east, north' END) || ': ' || format_number("offset_e_m", 2) || ' m, ' || format_number("offset_n_m", 2) || ' m; ' || (CASE WHEN left(@qgis_locale, 2) = 'de' THEN 'gedreht' WHEN left(@qgis_locale, 2) = 'es' THEN 'girada' ELSE 'turned' END) || ' ' || format_number("rot_deg", 1) || '°', '') %][% coalesce('&lt;br>' || replace(replace(replace("reason", '&amp;', '&amp;amp;'), '&lt;', '&amp;lt;'), '>', '&amp;gt;'), '') %]</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
