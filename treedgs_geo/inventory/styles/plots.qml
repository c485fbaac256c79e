<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis labelsEnabled="0" minScale="100000000" styleCategories="LayerConfiguration|Symbology|Labeling|Fields|Forms|MapTips|AttributeTable|Rendering" simplifyMaxScale="1" symbologyReferenceScale="-1" simplifyDrawingHints="1" simplifyLocal="1" simplifyAlgorithm="0" maxScale="0" simplifyDrawingTol="1" version="3.22.16-Białowieża" readOnly="0" hasScaleBasedVisibilityFlag="0">
  <flags>
    <Identifiable>1</Identifiable>
    <Removable>1</Removable>
    <Searchable>1</Searchable>
    <Private>0</Private>
  </flags>
  <renderer-v2 enableorderby="0" referencescale="-1" type="categorizedSymbol" attr="status" symbollevels="0" forceraster="0">
    <categories>
      <category label="placed" render="true" symbol="0" value="auto"/>
      <category label="confirmed by hand" render="true" symbol="1" value="ok"/>
      <category label="needs a hand check" render="true" symbol="2" value="check"/>
    </categories>
    <symbols>
      <symbol type="fill" force_rhr="0" name="0" alpha="1" clip_to_extent="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleFill" locked="0" pass="0" enabled="1">
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
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="85,85,85,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.4" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="fill" force_rhr="0" name="1" alpha="1" clip_to_extent="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleFill" locked="0" pass="0" enabled="1">
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
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="46,139,61,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.6" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol type="fill" force_rhr="0" name="2" alpha="1" clip_to_extent="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer class="SimpleFill" locked="0" pass="0" enabled="1">
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
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="106,61,154,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.9" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
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
    <field configurationFlags="None" name="plot_id">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="status">
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
    <field configurationFlags="None" name="reason">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="offset_e_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="offset_n_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="rot_deg">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="ratio">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="margin">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="residual_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="share">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="n_field">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="n_measured">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="n_pairs">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="n_sugg">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="radius_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="x">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="y">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" name="Plot" field="plot_id"/>
    <alias index="1" name="Status" field="status"/>
    <alias index="2" name="Reason" field="reason"/>
    <alias index="3" name="Moved east [m]" field="offset_e_m"/>
    <alias index="4" name="Moved north [m]" field="offset_n_m"/>
    <alias index="5" name="Turned clockwise [°]" field="rot_deg"/>
    <alias index="6" name="Score over the next best placing" field="ratio"/>
    <alias index="7" name="Log-likelihood over the next best placing" field="margin"/>
    <alias index="8" name="Residual of the pairs [m]" field="residual_m"/>
    <alias index="9" name="Share of trees with a partner within 1 m" field="share"/>
    <alias index="10" name="Field trees" field="n_field"/>
    <alias index="11" name="Measured trees in the circle" field="n_measured"/>
    <alias index="12" name="Pairs" field="n_pairs"/>
    <alias index="13" name="Suggestions" field="n_sugg"/>
    <alias index="14" name="Radius [m]" field="radius_m"/>
    <alias index="15" name="Easting of the centre, co-registered [m]" field="x"/>
    <alias index="16" name="Northing of the centre, co-registered [m]" field="y"/>
  </aliases>
  <defaults>
    <default applyOnUpdate="0" expression="" field="plot_id"/>
    <default applyOnUpdate="0" expression="" field="status"/>
    <default applyOnUpdate="0" expression="" field="reason"/>
    <default applyOnUpdate="0" expression="" field="offset_e_m"/>
    <default applyOnUpdate="0" expression="" field="offset_n_m"/>
    <default applyOnUpdate="0" expression="" field="rot_deg"/>
    <default applyOnUpdate="0" expression="" field="ratio"/>
    <default applyOnUpdate="0" expression="" field="margin"/>
    <default applyOnUpdate="0" expression="" field="residual_m"/>
    <default applyOnUpdate="0" expression="" field="share"/>
    <default applyOnUpdate="0" expression="" field="n_field"/>
    <default applyOnUpdate="0" expression="" field="n_measured"/>
    <default applyOnUpdate="0" expression="" field="n_pairs"/>
    <default applyOnUpdate="0" expression="" field="n_sugg"/>
    <default applyOnUpdate="0" expression="" field="radius_m"/>
    <default applyOnUpdate="0" expression="" field="x"/>
    <default applyOnUpdate="0" expression="" field="y"/>
  </defaults>
  <constraints>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="plot_id" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="status" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="reason" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="offset_e_m" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="offset_n_m" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="rot_deg" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="ratio" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="margin" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="residual_m" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="share" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="n_field" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="n_measured" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="n_pairs" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="n_sugg" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="radius_m" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="x" notnull_strength="0"/>
    <constraint constraints="0" exp_strength="0" unique_strength="0" field="y" notnull_strength="0"/>
  </constraints>
  <constraintExpressions>
    <constraint exp="" field="plot_id" desc=""/>
    <constraint exp="" field="status" desc=""/>
    <constraint exp="" field="reason" desc=""/>
    <constraint exp="" field="offset_e_m" desc=""/>
    <constraint exp="" field="offset_n_m" desc=""/>
    <constraint exp="" field="rot_deg" desc=""/>
    <constraint exp="" field="ratio" desc=""/>
    <constraint exp="" field="margin" desc=""/>
    <constraint exp="" field="residual_m" desc=""/>
    <constraint exp="" field="share" desc=""/>
    <constraint exp="" field="n_field" desc=""/>
    <constraint exp="" field="n_measured" desc=""/>
    <constraint exp="" field="n_pairs" desc=""/>
    <constraint exp="" field="n_sugg" desc=""/>
    <constraint exp="" field="radius_m" desc=""/>
    <constraint exp="" field="x" desc=""/>
    <constraint exp="" field="y" desc=""/>
  </constraintExpressions>
  <expressionfields/>
  <attributetableconfig sortExpression="" sortOrder="0" actionWidgetStyle="dropDown">
    <columns/>
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
  <editable/>
  <labelOnTop/>
  <reuseLastValue/>
  <dataDefinedFieldProperties/>
  <widgets/>
  <previewExpression>"plot_id"</previewExpression>
  <mapTip>&lt;b>Plot [% "plot_id" %]&lt;/b> ([% "status" %])&lt;br>[% "n_pairs" %] of [% "n_field" %] field trees paired&lt;br>moved [% format_number("offset_e_m", 2) %] m east, [% format_number("offset_n_m", 2) %] m north, turned [% format_number("rot_deg", 1) %]°[% coalesce('&lt;br>' || "reason", '') %]</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
